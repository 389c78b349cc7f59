"""The equations of motion, carried through time by two propagators.

`exact` multiplies by matrices, on smooth pads, in the loop of `advance`. `runge_kutta` steps by the `forces` of a
rough contact: `steps` chooses each step by its error, `between` loops over them from sample to sample, and `grid`
takes a fixed number. Whoever fills the record (`samples`, `steps`, `flow`) sets `propagator`.

A propagator carries the block of a motion (`block.Block`) from event to event.

1. The motion that is reached stands in `z`, with U, Q and their slopes, in the phase `phase`, at `base` + `time`.
2. A step lies within a phase, and between two knots of speed and load.
3. Margins (`phases`) are looked at inside a step as well: one that dips below zero is found, as far as rounding
   shows it (`exact.unseen`); in Runge-Kutta steps as far as their cubic shows it.
4. A step ends at the first margin that runs out, `which`, located on the motion itself and not on a fit.
5. It hands over to `events.pass_event`, and says there whether friction holds the shoe (`events.enter_phase`).
6. It says how the margin falls, and the rates before and behind the event (`columns.jump`).
7. It carries `count` small disturbances in `columns`, by the derivative of the motion or of its steps.
8. In stick x less what the wheel has travelled stays: it is kept as the anchor, by which samples take x anew.
9. It adds works to `work` where `account` is 1, and notes turning points in `track` where that is on.
10. Its loop returns how it has ended (`events.DONE`): after many steps as well, so that Python hears signals, for
    which `grid` asks itself. All is in the record, to go on to the bit. A step of `steps`, and what samples a loop
    (`samples`, `between`), return a `Failure`.

A third one has a number beside `block.MATRICES`, and a record in the plant if it needs one; branches in
`enter_phase`, `look` and `pass_event` of `events` and in `jump` and `hold_on` of `columns`, where what is not
Runge-Kutta is matrices; a loop as those of `advance`, `between` and `grid`, which finds its first phase; what
samples it; and an entry in `tasks`. A case can name it once a scheme does.
"""
