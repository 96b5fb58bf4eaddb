"""What is refused is one line that says where, what came and what is allowed."""

from collections.abc import Callable
from typing import Any

import pytest

from stillhook.errors import StillhookError


def refused(
    call: Callable[..., Any], *arguments: Any, error: type[StillhookError] = StillhookError, **more: Any
) -> str:
    """The line with which a call with these arguments is refused."""
    with pytest.raises(error) as caught:
        call(*arguments, **more)
    line = str(caught.value)
    assert "\n" not in line
    return line
