"""What a claim rests on: a certificate that covers something, else the flat share, else nothing."""

from types import SimpleNamespace

import numpy as np
import pytest

from stillhook.plan.assessments.card.claim import credit_of
from stillhook.plan.definition.rules import Alternative
from stillhook.spec.validity import CAP

ALTERNATIVES = (Alternative.NONE, Alternative.CAP, Alternative.SSC)
CAPPED = {"by": "cap", "cap": CAP}


def rests_on(alternative, *, covers=(1.0, np.nan), compensated=(True, False), certificate=True, synthetic=False):
    """Of two phases, the twin compensating those that are compensated."""
    certified = SimpleNamespace(real=not synthetic, short="0123") if certificate else None
    phases = [SimpleNamespace(compensated=each) for each in compensated]
    plan = SimpleNamespace(phases=phases, crane=SimpleNamespace(certified=certified))
    needs = np.array([[False, False], [False, False], compensated])
    share = np.array([[np.nan, np.nan], [np.nan, np.nan], covers])[:, :, None, None]
    of = SimpleNamespace(
        axes=SimpleNamespace(alternatives=ALTERNATIVES), certified=SimpleNamespace(needs=needs, share=share)
    )
    return credit_of(plan, of, alternative)


def test_a_twin_within_its_certificate_is_credited_by_it_with_the_share_that_it_covers():
    by = {"by": "certificate", "certificate": "0123", "cap": CAP}
    assert rests_on(Alternative.SSC) == {**by, "share": 1.0}
    assert rests_on(Alternative.SSC, covers=(0.25, np.nan)) == {**by, "share": 0.25}


@pytest.mark.parametrize("how", [{"covers": (0.0, np.nan)}, {"certificate": False}, {"synthetic": True}])
def test_a_certificate_that_covers_nothing_or_is_none_or_synthetic_leaves_the_flat_share(how):
    assert rests_on(Alternative.SSC, **how) == CAPPED


def test_the_flat_share_rests_on_no_certificate_whatever_the_crane_has():
    assert rests_on(Alternative.CAP) == CAPPED


def test_where_nothing_is_compensated_nothing_is_claimed():
    assert rests_on(Alternative.NONE) == {"by": "none"}
    assert rests_on(Alternative.SSC, compensated=(False, False)) == {"by": "none"}
    assert rests_on(Alternative.CAP, compensated=(False, False)) == {"by": "none"}
