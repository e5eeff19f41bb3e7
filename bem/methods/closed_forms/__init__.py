"""Closed-form solutions the solver and its studies are compared with, one module each, in dimensionless units.

Force in pi R dgamma, positive in tension; indentation in h0; contact radius in beta, beta^3 = R^2 dgamma/E0*; `tabor`
is mu = (R dgamma^2 / (E0*^2 h0^3))^(1/3), so that beta^2 / (R h0) = mu and beta dgamma / (E0* h0^2) = mu^2.
"""
