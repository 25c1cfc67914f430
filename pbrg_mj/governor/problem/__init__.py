"""What a governor is given and answers, and how half-spaces become its constraints.

- `rows`: rows a rho + C m - d <= 0 and their values
- `lazy_rows`: rows of the state, evaluated when they are read
- `ball`: the paper's certificate, eqs. 3-8 and 13; another certificate is another file beside it
- `directional_ball`: the ball of the motion across each half-space alone
- `near_reference`: how far away the operator's reference may pull
- `motion`: the state that predictions start from
- `interface`: `Problem`, `Solution`, and the protocols `Certificate` and `Governor`
- `block_references`: the references and least costs of many ticks at once
"""
