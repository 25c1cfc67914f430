"""The optimum of the whole problem (eqs. 10-15), by solvers that know everything.

- `optimum`: what a solver returns
- `clarabel_solver`: the small form, four cone dimensions for any number of robots
- `directional_form`: the form for rows with directions, a cone of three dimensions for each
- `cvxpy_solver`: the same as one reads it, the oracle
- `within_range`: where the optimum proves that nothing near the team is admissible, there is none
"""
