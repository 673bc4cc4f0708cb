"""Public names of the closed forms, each with the module that it is imported from when it is first used."""

from roughvisc.mechanics.closed_forms.elastic import flat_punch as flat_punch
from roughvisc.mechanics.closed_forms.elastic import full_contact_pressure as full_contact_pressure
from roughvisc.mechanics.closed_forms.elastic import hertz as hertz
from roughvisc.mechanics.closed_forms.elastic import johnson_greenwood_higginson as johnson_greenwood_higginson
from roughvisc.mechanics.closed_forms.elastic import sneddon_cone as sneddon_cone
from roughvisc.mechanics.closed_forms.elastic import westergaard as westergaard
from roughvisc.mechanics.closed_forms.growing_contact import lee_radok as lee_radok
from roughvisc.mechanics.closed_forms.growing_contact import lee_radok_step as lee_radok_step
from roughvisc.mechanics.closed_forms.indenters import Cone as Cone
from roughvisc.mechanics.closed_forms.indenters import Paraboloid as Paraboloid
