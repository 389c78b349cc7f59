"""What a case or a motion means: pure functions of systems and motions, no command and no result file.

`stability.report.stability` says where steady sliding loses its stability and by which modes; `regime.classify`
says whether a motion is damped, relaxation or quasi-harmonic, with its evidence; `fate.fate` what it comes to
in the end.

`branches/` follows motions through a parameter, stable or not; its engine knows no brakes. `signals/` judges
measured records. `over_time` shows what changes during a stop, `similar` makes a brake of one's own of a
starter.

Motions come from `solver`; whole studies of many are in `studies`.
"""
