"""What is evaluated of every tick and never fed back.

- `tick_block`: the problems of ticks in a row, as arrays
- `diagnostics`: storage, worst row, spread and KKT residuals of the applied reference
- `equilibrium`: where the flow comes to rest
- `passivity`: the balances of the convergence proof, at one state
- `passivity_blocks`: the same for blocks of ticks
- `passivity_monitor`: which of them a governor has
"""
