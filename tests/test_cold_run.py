"""What a whole run takes, from the tables that Snakemake's benchmarks write."""

from __future__ import annotations

from pathlib import Path

from studies import cold_run

HEAD = "s\th:m:s\tmax_rss\tcpu_time\n"


def test_jobs_are_summed_by_rule(tmp_path: Path) -> None:
    for rule, jobs in {
        "figure": ["2.0\t0:00:02\t-\t0"],
        "assess": ["30.5\t0:30\t210.5\t29", "9.5\t0:09\t190\t9"],
    }.items():
        (tmp_path / rule).mkdir()
        for k, job in enumerate(jobs):
            (tmp_path / rule / f"{k}.tsv").write_text(HEAD + job + "\n", encoding="utf-8")
    data = cold_run.of_benchmarks(tmp_path, 25.0, 2)
    assert list(data["rule"].values) == ["assess", "figure"]
    assert data["jobs"].values.tolist() == [2.0, 1.0]
    assert data["seconds"].values.tolist() == [40.0, 2.0]
    assert data["longest"].values.tolist() == [30.5, 2.0]
    assert data["memory"].values.tolist() == [210.5, 0.0]
    table = cold_run.table(data)
    assert "| assess | 2 | 40 | 95% | 30.5 | 210 |" in table
    assert "| all, 2 cores | 3 | 42 |" in table
    assert "| from start to end | | 25 |" in table
