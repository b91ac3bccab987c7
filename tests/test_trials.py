"""The records of a campaign survive that it is stopped."""

import pytest

from tests.campaigns.trials import read_records, run_trials


def test_stopped_campaign_goes_on(tmp_path):
    path, ran = tmp_path / "records" / "trials.jsonl", []

    def trial(number):
        if number == stop_at:
            raise KeyboardInterrupt
        ran.append(number)
        return {"square": number * number}

    stop_at = 2
    with pytest.raises(KeyboardInterrupt):
        run_trials(path, range(4), trial)
    with path.open("a") as file:
        file.write('{"trial": 2, "squ')
    stop_at = None
    records = run_trials(path, range(4), trial)
    assert ran == [0, 1, 2, 3]
    assert [record["square"] for record in records] == [0, 1, 4, 9]
    assert sorted(read_records(path)) == [0, 1, 2, 3]
    assert run_trials(path, range(4), trial) == records
    assert len(ran) == 4
