"""What a user gives: case files, read with every problem at once, and a case in numbers.

`read.parse_case` makes a `Case` (`case`) of a TOML text, with the line of each problem; `system.system_of`
makes of it the `System` that the solver carries through time.

`parts` holds the tables of a case, `tables` what tables can and how they are declared, from which `json_schema`
comes as well. `roughness` and `profile` make sines of surfaces, `restart` reads the end of another run,
`starters/` holds the cases that `brakecli new` writes.
"""
