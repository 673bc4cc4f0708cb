"""The public names of roughvisc and the modules that define them: for editors, for mypy, and for ``__init__.py``."""

from roughvisc import materials as materials
from roughvisc import observables as observables
from roughvisc import plot as plot
from roughvisc import surfaces as surfaces
from roughvisc.api import friction as friction
from roughvisc.api import run as run
from roughvisc.api import simulate as simulate
from roughvisc.errors import ConvergenceError as ConvergenceError
from roughvisc.errors import EdgeContactError as EdgeContactError
from roughvisc.errors import InputError as InputError
from roughvisc.errors import RoughviscError as RoughviscError
from roughvisc.errors import TooLargeError as TooLargeError
from roughvisc.experiment.sliding import SteadySliding as SteadySliding
from roughvisc.judge.audit import audit as audit
from roughvisc.judge.budget import budget as budget
from roughvisc.judge.plan import plan as plan
from roughvisc.judge.trade import trade as trade
from roughvisc.materials import *
from roughvisc.mechanics import closed_forms as closed_forms
from roughvisc.mechanics.adhesion import adhesion as adhesion
from roughvisc.mechanics.heating import Heating as Heating
from roughvisc.mechanics.program import Program as Program
from roughvisc.observables.friction_theory import friction_theory as friction_theory
from roughvisc.plot.report import report as report
from roughvisc.runs.csv_files import to_csv as to_csv
from roughvisc.runs.csv_files import to_table as to_table
from roughvisc.runs.netcdf import open_result as open_result
from roughvisc.runs.netcdf import save_result as save_result
from roughvisc.runs.observed import observe as observe
from roughvisc.runs.sweep import sweep as sweep
from roughvisc.runs.sweep_data import open_results as open_results
from roughvisc.settings import Numerics as Numerics
from roughvisc.study.case import Case as Case
from roughvisc.study.case import read_cases as read_cases
from roughvisc.study.case import read_study as read_study
from roughvisc.study.case import vary as vary
from roughvisc.study.machine_history import read_program as read_program
from roughvisc.study.records import fit_material as fit_material
from roughvisc.study.records import read_record as read_record
from roughvisc.study.sweep_table import over_realisations as over_realisations
from roughvisc.surfaces import *
from roughvisc.topography import example_scan as example_scan
from roughvisc.topography.exchange import to_topography as to_topography
from roughvisc.topography.filters import fill as fill
from roughvisc.topography.filters import gaussian_filter as gaussian_filter
from roughvisc.topography.filters import level as level
from roughvisc.topography.filters import mask_outliers as mask_outliers
from roughvisc.topography.formats import supported_formats as supported_formats
from roughvisc.topography.framing import crop as crop
from roughvisc.topography.framing import invert as invert
from roughvisc.topography.framing import rotate90 as rotate90
from roughvisc.topography.inspection import inspect as inspect
from roughvisc.topography.parameters import parameters as parameters
from roughvisc.topography.radial_spectrum import join_psd as join_psd
from roughvisc.topography.radial_spectrum import psd_table as psd_table
from roughvisc.topography.scans import save_scan as save_scan
from roughvisc.topography.spectrum import psd as psd
from roughvisc.topography.spectrum import resample as resample
from roughvisc.topography.spectrum import without_short_waves as without_short_waves

__version__: str
