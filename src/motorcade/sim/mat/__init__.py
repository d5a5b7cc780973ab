"""Mats: the places that cars drive on, with all that stands, walks, speaks and disturbs there."""

from motorcade.sim.errors import MatError as MatError
from motorcade.sim.mat.check import check_mat as check_mat
from motorcade.sim.mat.file import parse_mat as parse_mat
from motorcade.sim.mat.file import read_mat as read_mat
from motorcade.sim.mat.model import Mat as Mat
from motorcade.sim.mat.model import Person as Person
from motorcade.sim.mat.model import Physics as Physics
from motorcade.sim.mat.model import Pose as Pose
from motorcade.sim.mat.model import Starts as Starts
from motorcade.sim.mat.model import Voice as Voice
from motorcade.sim.mat.model import formation as formation
from motorcade.sim.mat.model import open_table as open_table
