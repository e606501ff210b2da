"""What a launch file may say of models, and what is refused before anything starts."""

import pytest

from busflow.errors import InvalidParameter
from busflow.testing import harness, virtual_time
from busflow_assistant.assistant import Assistant
from tests.golden import Golden

LOCAL = {"url": "http://127.0.0.1:9", "model": "m"}


@pytest.mark.parametrize(
    "endpoint",
    [
        {"url": "ftp://host", "model": "m"},
        {"url": "http://example.org/v1", "model": "m"},
        {"url": "https://key@example.org/v1", "model": "m"},
        {"url": "https://example.org/v1?key=1", "model": "m"},
        {"url": "https://example.org/v1"},
        LOCAL | {"api_key_env": "ASSISTANT_KEY_THAT_IS_NOT_SET"},
        LOCAL | {"api_key_env": "sk-0123456789"},
    ],
)
def test_endpoint_that_cannot_be_is_refused(endpoint, golden):
    with golden.raises(InvalidParameter):
        Assistant(endpoint=endpoint)


def test_folder_without_a_model_is_refused(tmp_path, golden):
    with golden.raises(InvalidParameter):
        Assistant(embedder={"model_dir": str(tmp_path)})


@virtual_time
async def test_endpoint_cannot_be_set_at_run_time(golden: Golden):
    async with harness(Assistant) as lab:
        with golden.raises(InvalidParameter):
            lab.set_parameters(Assistant, {"endpoint.url": "https://example.org/v1", "endpoint.model": "m"})
