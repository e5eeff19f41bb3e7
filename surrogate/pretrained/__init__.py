"""Two models off the shelf for any standard linear solid, `fast` and `accurate`, with known uncertainty.

`surrogate.load("fast")` and `surrogate.load("accurate")` read them. They take the inputs F on the measurement steps of
`bem.dataset.physical_steps`; `docs/surrogate-models.md` says how they were trained and how far they can be trusted.
"""
