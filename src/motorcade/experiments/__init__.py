"""Large experiments: many programs, mats, parameters and seeds in one table.

`spec` reads the specification and knows what can vary, `plan` divides the runs into tasks, `task` does one, `run` does
all of them, on this computer or on a cluster, and `picture` draws the table.
"""
