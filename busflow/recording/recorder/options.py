"""The specification of a recording, from the values that a caller may give as `record=`."""

from __future__ import annotations

from collections.abc import Mapping

from pydantic import ValidationError

from busflow.errors import InvalidParameter
from busflow.launchfile.load.build import record_spec
from busflow.launchfile.model.description import RecordSpec
from busflow.launchfile.model.keys import RecordKeys
from busflow.runner.graph import Wanted
from busflow.validation.faults import faults


def spec_of(wanted: Wanted | None, stated: RecordSpec | None) -> RecordSpec | None:
    """Return the specification of a recording; None for no recording.

    >>> spec_of({"to": "run.mcap", "topics": ["/imu/*"]}, None).topics
    ('/imu/*',)

    Args:
        wanted: as the caller gives it; None leaves it to the launch file.
        stated: as the launch file says.

    Raises:
        InvalidParameter: the keys cannot be, with every reason.
    """
    if isinstance(wanted, bool) or wanted is None:
        return None if wanted is False else stated
    if isinstance(wanted, RecordSpec):
        return wanted
    data = dict(wanted) if isinstance(wanted, Mapping) else {"to": str(wanted)}
    try:
        return record_spec(RecordKeys.model_validate(data))
    except ValidationError as error:
        raise InvalidParameter(faults(error, RecordKeys, data, noun="key")) from None
