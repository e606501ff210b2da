"""Parameters of the models that an assistant may use; without them it uses none."""

from __future__ import annotations

import os
from importlib.util import find_spec
from ipaddress import ip_address
from pathlib import Path
from typing import Self
from urllib.parse import urlsplit

from pydantic import Field, model_validator

from busflow import Parameters, ReadOnly
from busflow.errors import how_to_install

_INSTALL = how_to_install("busflow", "busflow-assistant[assistant]")
_NAME = r"^[A-Za-z_][A-Za-z0-9_]{0,63}$|^$"


class EndpointParameters(Parameters):
    """A server with a language model; read-only, so that nothing can turn it on while the graph runs."""

    url: ReadOnly[str] = Field(default="", description="An OpenAI-compatible server: http://127.0.0.1:11434/v1; none.")
    model: ReadOnly[str] = Field(default="", description="The model's name there.")
    api_key_env: ReadOnly[str] = Field(
        default="", pattern=_NAME, description="The environment variable with the key, not the key."
    )
    timeout_s: ReadOnly[float] = Field(default=20.0, gt=0, le=600, description="The longest wait for an answer, s.")
    max_tokens: ReadOnly[int] = Field(default=300, ge=1, le=4096, description="The longest answer.")
    requests_per_hour: ReadOnly[int] = Field(default=60, ge=1, le=100_000, description="More are answered without it.")

    @model_validator(mode="after")
    def is_complete(self) -> Self:
        """Refuse what could not work, or would send a key in the clear."""
        if not self.url:
            return self
        parts = urlsplit(self.url)
        if parts.scheme not in {"http", "https"} or not parts.hostname:
            raise ValueError("url must begin with http:// or https:// and name a host")
        if parts.username or parts.password or parts.query:
            raise ValueError("url must hold no key; name its environment variable in api_key_env")
        if parts.scheme == "http" and not _is_this_machine(parts.hostname):
            raise ValueError("url must be https, except on this machine: questions would be sent in the clear")
        if not self.model:
            raise ValueError("model must name a model of the server")
        if self.api_key_env and not os.environ.get(self.api_key_env):
            raise ValueError(f"the environment variable {self.api_key_env} is not set")
        if find_spec("httpx") is None:
            raise ValueError(f"httpx is not installed; {_INSTALL}")
        return self


class EmbedderParameters(Parameters):
    """A model of sentences, in a folder."""

    model_dir: ReadOnly[str] = Field(default="", description="A folder with tokenizer.json and model.safetensors.")

    @model_validator(mode="after")
    def is_there(self) -> Self:
        """Refuse a folder without a model."""
        if not self.model_dir:
            return self
        for file in ("config.json", "tokenizer.json", "model.safetensors"):
            if not Path(self.model_dir, file).is_file():
                raise ValueError(f"there is no {file} in {self.model_dir}")
        for module in ("tokenizers", "safetensors"):
            if find_spec(module) is None:
                raise ValueError(f"{module} is not installed; {_INSTALL}")
        return self


def _is_this_machine(host: str) -> bool:
    if host == "localhost":
        return True
    try:
        return ip_address(host).is_loopback
    except ValueError:
        return False
