"""Analytic solutions of frictionless normal contact: the references that the numerical solver is tested against.

Elastic solutions take the contact modulus ``E* = 2 G / (1 - nu) = E / (1 - nu^2)``; viscoelastic ones take a
material with the contact compliance ``C(t)``, which is ``1 / E*`` of an elastic one.

``__init__.pyi`` lists the names; each is imported from its module when first used.
"""

from roughvisc.lazy import public_names

__getattr__, __all__ = public_names(globals())


def __dir__() -> list[str]:
    return __all__
