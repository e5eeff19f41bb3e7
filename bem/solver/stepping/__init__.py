"""How the state advances in time: predict, solve, judge, accept, record."""
