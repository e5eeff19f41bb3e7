import numpy as np
from scipy.special import ellipe, ellipkm1

from bem.discretisation.elliptic_integrals import elliptic_integrals


def test_elliptic_integrals_agree_with_scipy():
    complement = np.concatenate([[1e-300, 1e-30], np.geomspace(1e-16, 1.0, 200)])
    first, second = elliptic_integrals(complement)
    np.testing.assert_allclose(first, ellipkm1(complement), rtol=2e-15)
    np.testing.assert_allclose(second, ellipe(1.0 - complement), rtol=1e-14)
