r"""The instantaneous contact state: an elastic contact problem under given load or given approach.

Minimise ``f(p) = p.Kp/2 + g.p`` over ``p >= 0`` (and ``sum p`` given, under load), where ``g`` is the gap that the
surfaces would have without pressure. Nothing here knows of time or material: pressure is divided by the contact
modulus, and a memory of the past is part of ``g``.

The method is that of constrained conjugate gradients on an evolving contact area [1]_, with these changes:

1. Preconditioned by the inverse of the periodic kernel, and conjugated to the step really taken (Hestenes-Stiefel),
   also when that step was cut by the contact's border, instead of restarting whenever the area changes.
2. One convolution an iteration: the step is first cut at zero pressure, then its convolution gives both the exact
   minimum along it and the new displacement. Printed algorithms spend one convolution on the step length and
   another on the cut pressure.
3. Every step descends, and a projected-gradient step is taken wherever progress stalls (a spacer step), so that
   convergence is proven. No normal run needs it.
4. Stopped on the duality gap, a bound on the error that costs nothing, not on the stagnation of the pressure. Under
   given approach and periodic boundaries that norm does not see the mean pressure, since a uniform pressure displaces
   nothing: there the load must be certain, too.
5. Without a first guess, a sparse contact is found on every eighth cell first.
6. Far from the solution, steps are convolved in single precision and added to the displacement in double. What that
   leaves is 1e-7 of the steps and not of the displacement; before the solution is accepted, its displacement is
   computed anew in double precision, and judged.

.. [1] I. A. Polonsky, L. M. Keer, Wear 231 (1999) 206.
"""

from roughvisc.mechanics.contact.solver import ContactState, solve_contact

__all__ = ["ContactState", "solve_contact"]
