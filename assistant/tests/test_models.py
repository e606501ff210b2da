"""What a launch file may say of models, and what is refused before anything starts."""

import pytest

from busflow.errors import InvalidParameter
from busflow.testing import harness, virtual_time
from busflow_assistant.assistant import Assistant

LOCAL = {"url": "http://127.0.0.1:9", "model": "m"}


@pytest.mark.parametrize(
    ("endpoint", "why"),
    [
        ({"url": "ftp://host", "model": "m"}, "must begin with http"),
        ({"url": "http://example.org/v1", "model": "m"}, "must be https"),
        ({"url": "https://key@example.org/v1", "model": "m"}, "must hold no key"),
        ({"url": "https://example.org/v1?key=1", "model": "m"}, "must hold no key"),
        ({"url": "https://example.org/v1"}, "model must name"),
        (LOCAL | {"api_key_env": "ASSISTANT_KEY_THAT_IS_NOT_SET"}, "is not set"),
        (LOCAL | {"api_key_env": "sk-0123456789"}, "api_key_env"),
    ],
)
def test_endpoint_that_cannot_be_is_refused(endpoint, why):
    with pytest.raises(InvalidParameter, match=why):
        Assistant(endpoint=endpoint)


def test_folder_without_a_model_is_refused(tmp_path):
    with pytest.raises(InvalidParameter, match=r"there is no config\.json"):
        Assistant(embedder={"model_dir": str(tmp_path)})


@virtual_time
async def test_endpoint_cannot_be_set_at_run_time():
    async with harness(Assistant) as lab:
        with pytest.raises(InvalidParameter, match="read-only"):
            lab.set_parameters(Assistant, {"endpoint.url": "https://example.org/v1", "endpoint.model": "m"})
