"""The governor room: problem, certificate, distributed algorithm, centralized reference, baselines."""
