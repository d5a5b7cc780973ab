"""Large experiments: many programs, mats, parameters and seeds in one table.

`spec` reads what is wanted, `parameters` and `points` say what varies, `plan` cuts it into tasks, `task` runs one,
`schedule` runs all of them, in `processes` or on a `cluster`, `store` keeps what is finished, and `picture` draws the
result.
"""
