"""Mats: the places that cars drive on, with walls, obstacles, people, voices and physics."""

from motorcade.mats.document import check_mat as check_mat
from motorcade.mats.document import parse_mat as parse_mat
from motorcade.mats.document import read_mat as read_mat
from motorcade.mats.model import Mat as Mat
from motorcade.mats.model import Person as Person
from motorcade.mats.model import Physics as Physics
from motorcade.mats.model import Pose as Pose
from motorcade.mats.model import Starts as Starts
from motorcade.mats.model import Voice as Voice
from motorcade.mats.model import formation as formation
from motorcade.mats.model import open_table as open_table
from motorcade.mats.model import playground as playground
