"""Studies of the surrogates beyond the paper's: measurement steps, errors on hidden protocols, what they cost."""
