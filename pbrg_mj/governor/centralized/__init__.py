"""The optimum of the whole problem, by solvers that know everything."""
