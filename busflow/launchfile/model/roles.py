"""Role: what somebody whom a certificate names may do in a run that listens."""

from __future__ import annotations

import re
from enum import StrEnum

NAME = re.compile("[A-Za-z][A-Za-z0-9_-]{0,31}")
"""What machines and those that join a run may be called: the common name of their certificate, and its file's name."""


class Role(StrEnum):
    """What a certificate lets do."""

    READ = "read"
    """Look, and receive topics; not publish, call or set."""
    ALL = "all"
    """All that who started the run may do."""
