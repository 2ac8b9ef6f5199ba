# SPDX-License-Identifier: BSD-3-Clause
from ._dyop import *
from ._dyop import __version__ as __version__
