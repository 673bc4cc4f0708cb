"""Materials and studies that several files of tests share."""

import roughvisc as rv

#: Contact modulus 1.
UNIT = rv.elastic(0.25)
#: Retarded in 0.1 s; four times as compliant in the end.
RUBBER = rv.zener(3e6, 1e6, 1e5)
#: Retarded in 1 ms, for speeds of 0.1 m/s on waves of 1 mm.
QUICK_RUBBER = rv.zener(1e6, 0.3e6, 0.3e3)
#: A layer and a base that creep in different times.
COMPRESSIBLE, POLYMER = rv.zener(3e6, 1e6, 1e5, poisson=0.4), rv.zener(1e7, 2e6, 2e4, poisson=0.3)
