import sys,time
from brakecli.case_reading import read_case
from brakecli.compare.comparison import compare
t=time.time()
r=compare(read_case(sys.argv[1], sys.argv[3:]).case, budget=float(sys.argv[2]))
print(time.time()-t, "duration",r.duration,"ref err",r.reference_error,r.reference_seconds,"repeats",r.repeats,"left",r.left_out)
for e in r.entries:
    er=e.errors
    print(f"{e.rung.method.label():48} {e.rung.step or e.rung.tolerance:9.2e}", f"{er.error:.2e} ord {e.order if e.order is None else round(e.order,2)} Fmean {er.mean['friction_force']:.1e} amp {er.amplitude} ph {er.phase}" if er else e.failure[:60], f"{e.wall_seconds or 0:.4f}s bias {e.critical_bias} lim {e.step_limit}", "*" if e.on_front else "")
