"""The equations of motion, carried through time. No TOML, no pydantic, no file.

A `System` (`system`) holds the numbers of a case. `integrate` carries it from sample to sample by one of
`SCHEMES` (`schemes`) and gives a `Motion`; `flow` in `motion.flow` carries a state through a span and knows its
derivative.

`steps/` holds the schemes, `contact/` the evaluators of the contact, `motion/` the automaton of stick, slip and
flight with its two propagators, `lanes/` many motions side by side. `phases`, `block`, `records` and `plant`
are what compiled code works on. `kernels` compiles and keeps it, `beforehand` sees to it that nobody waits.

A case becomes a system in `case.system`; what the motion means is said in `analysis`.
"""
