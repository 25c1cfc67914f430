"""One self-contained page about one or several runs: figures, a animation seen from above, numbers, the scenario."""
