"""Dynamic identification of robots: from a motion log to parameters, with no simulator and no viewer.

Letters: q, qd, qdd [rad, rad/s, rad/s^2], tau [N m], fs sampling frequency [Hz], T = 1/fs, n joints, N samples; W
observation matrix (r x p), Y measurement vector (r), X parameters (p), rho residual, s = d/dt. Frequencies are in Hz. Equation
numbers are those of "A comparison of filtered models for dynamic identification of robots" (M. Gautier, 35th IEEE Conference
on Decision and Control, 1996).
"""

from identify.arrays import Array as Array
from identify.arrays import Columns as Columns
from identify.base_parameters import BaseParameters as BaseParameters
from identify.basis import BLOCKS as BLOCKS
from identify.basis import AbstractBlock as AbstractBlock
from identify.basis import AbstractConservativeBlock as AbstractConservativeBlock
from identify.basis import AbstractFriction as AbstractFriction
from identify.basis import Armature as Armature
from identify.basis import Basis as Basis
from identify.basis import CoulombFriction as CoulombFriction
from identify.basis import Offset as Offset
from identify.basis import ScaraLinks as ScaraLinks
from identify.basis import TreeLinks as TreeLinks
from identify.basis import ViscousFriction as ViscousFriction
from identify.basis import scara as scara
from identify.basis import tree_basis as tree_basis
from identify.chain import CHAINS as CHAINS
from identify.chain import Chain as Chain
from identify.chain import idbench_chain as idbench_chain
from identify.chain import paper_chain as paper_chain
from identify.diagnosis import Instants as Instants
from identify.diagnosis import binned as binned
from identify.diagnosis import cutoffs as cutoffs
from identify.diagnosis import filtered as filtered
from identify.diagnosis import instants as instants
from identify.diagnosis import measured_state as measured_state
from identify.diagnosis import spectrum as spectrum
from identify.differentiators import DIFFERENTIATORS as DIFFERENTIATORS
from identify.differentiators import AbstractDifferentiator as AbstractDifferentiator
from identify.differentiators import CentralDifference as CentralDifference
from identify.errors import ExcitationError as ExcitationError
from identify.errors import IdentificationError as IdentificationError
from identify.errors import KinematicsError as KinematicsError
from identify.errors import LogError as LogError
from identify.errors import PluginError as PluginError
from identify.errors import SettingError as SettingError
from identify.errors import TimeError as TimeError
from identify.errors import UnknownNameError as UnknownNameError
from identify.estimate import Estimate as Estimate
from identify.estimators import ESTIMATORS as ESTIMATORS
from identify.estimators import AbstractEstimator as AbstractEstimator
from identify.estimators import OrdinaryLeastSquares as OrdinaryLeastSquares
from identify.estimators import Problem as Problem
from identify.estimators import WeightedLeastSquares as WeightedLeastSquares
from identify.kinematics import Joint as Joint
from identify.kinematics import KinematicTree as KinematicTree
from identify.masks import MASKS as MASKS
from identify.masks import AbstractMask as AbstractMask
from identify.masks import NoMask as NoMask
from identify.masks import ReversalMask as ReversalMask
from identify.models import MODELS as MODELS
from identify.models import AbstractModel as AbstractModel
from identify.models import ExplicitModel as ExplicitModel
from identify.models import ImplicitModel as ImplicitModel
from identify.models import PowerModel as PowerModel
from identify.motion_log import MotionLog as MotionLog
from identify.motion_log import TorqueChannel as TorqueChannel
from identify.noise import torque_noise as torque_noise
from identify.operators import OPERATORS as OPERATORS
from identify.operators import AbstractOperator as AbstractOperator
from identify.operators import FirLowPass as FirLowPass
from identify.operators import IirLowPass as IirLowPass
from identify.operators import ModulatingFunctions as ModulatingFunctions
from identify.operators import Windows as Windows
from identify.pipeline import identify as identify
from identify.pipeline import identify_each as identify_each
from identify.prefilters import PREFILTERS as PREFILTERS
from identify.prefilters import AbstractPrefilter as AbstractPrefilter
from identify.prefilters import ButterworthPrefilter as ButterworthPrefilter
from identify.prefilters import NoPrefilter as NoPrefilter
from identify.running import Running as Running
from identify.running import running_estimate as running_estimate
from identify.state import State as State
from identify.system import Status as Status
from identify.system import System as System
from identify.torques import ALIGNMENTS as ALIGNMENTS
from identify.torques import AbstractAlignment as AbstractAlignment
from identify.torques import AbstractTorque as AbstractTorque
from identify.torques import AsLogged as AsLogged
from identify.torques import ByChannel as ByChannel
