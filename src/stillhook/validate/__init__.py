"""Validation of a twin: logs of a crane's tests compared with the twin, step by step, by written
criteria.

Source: Moslatt 2020 paper F and sections 2.5-2.6.

>>> from stillhook import validate
>>> result = validate.validate("sea-trial/campaign.toml")  # doctest: +SKIP
>>> result.passed, [line.message for line in result.lines if line.failed]  # doctest: +SKIP
>>> validate.save_validation(result, "validation")  # doctest: +SKIP
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from stillhook.base.lazy import attached

if TYPE_CHECKING:
    from stillhook.validate.certificate.certificate import (
        Certificate,
        certificate_files,
        certificate_of,
        load_certificate,
    )
    from stillhook.validate.certificate.save import save_validation
    from stillhook.validate.criteria.criteria import Criteria, load_criteria
    from stillhook.validate.data_set.campaign import Campaign, load_campaign
    from stillhook.validate.validation import Validation, validate

_HOMES = {
    "Campaign": "validate.data_set.campaign",
    "Certificate": "validate.certificate.certificate",
    "Criteria": "validate.criteria.criteria",
    "Validation": "validate.validation",
    "certificate_files": "validate.certificate.certificate",
    "certificate_of": "validate.certificate.certificate",
    "load_campaign": "validate.data_set.campaign",
    "load_certificate": "validate.certificate.certificate",
    "load_criteria": "validate.criteria.criteria",
    "save_validation": "validate.certificate.save",
    "validate": "validate.validation",
}
__all__ = [
    "Campaign",
    "Certificate",
    "Criteria",
    "Validation",
    "certificate_files",
    "certificate_of",
    "load_campaign",
    "load_certificate",
    "load_criteria",
    "save_validation",
    "validate",
]

__getattr__, __dir__ = attached(__name__, _HOMES)
