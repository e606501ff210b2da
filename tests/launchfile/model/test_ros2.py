"""`Ros2Spec`: the domain of a run, stated or of the environment."""

import pytest

from busflow.errors import LaunchError
from busflow.launchfile.model.ros2 import Ros2Spec


@pytest.mark.parametrize(
    ("stated", "variable", "domain"), [(None, None, 0), (None, "", 0), (None, "7", 7), (0, "7", 0), (3, "no", 3)]
)
def test_domain_is_stated_or_of_the_environment(stated, variable, domain):
    assert Ros2Spec(stated).domain_in({} if variable is None else {"ROS_DOMAIN_ID": variable}) == domain


@pytest.mark.parametrize("text", ["233", "-1", "seven", "1.5", "7 ", "\u0667", "9" * 5000])
def test_wrong_domain_in_the_environment_is_refused(text, golden):
    with golden.raises(LaunchError) as caught:
        Ros2Spec().domain_in({"ROS_DOMAIN_ID": text})
    assert [each.code for each in caught.value.problems] == ["bad-domain"]
    assert len(str(caught.value)) < 300
