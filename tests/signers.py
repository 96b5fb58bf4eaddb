"""A key that is made for the tests of a process, in a trust list that they read in place of the user's."""

from typing import Any

from stillhook.spec.crane import Crane
from stillhook.spec.validity import Certified
from stillhook.trust.home import KEY as PRIVATE
from stillhook.trust.home import PUBLIC, home
from stillhook.trust.keys import SigningKey, new_key, write_key
from stillhook.trust.signature import Signed, sign
from stillhook.trust.trust_list import TrustedKey, users_trust

NAME = "Sea trials department"
KEY = new_key(NAME)


def trusted(key: SigningKey = KEY, **row: Any) -> None:
    """The tests' own trust list says this of a key; row: days and reason of `TrustedKey`."""
    users_trust().trusting(TrustedKey(key.name, key.public, **row)).write()


def with_key(key: SigningKey = KEY) -> None:
    """The tests' own key is this one, as a file."""
    for name in (PRIVATE, PUBLIC):
        (home() / name).unlink(missing_ok=True)
    write_key(key, home() / PRIVATE, home() / PUBLIC)


def signed(record: Certified, key: SigningKey = KEY) -> Certified:
    """The record as one that a key signed, judged by the tests' own trust list."""
    data = sign(Signed.CERTIFICATE, record.statement, key).to_dict()
    return record.model_copy(update={"signature": data}).judged(users_trust())


def signed_crane(crane: Crane) -> Crane:
    """The crane with its record signed."""
    assert crane.certified is not None
    return crane.model_copy(update={"certified": signed(crane.certified)})


trusted()
