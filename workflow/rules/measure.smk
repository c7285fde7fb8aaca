# Rules from logs to alpha (src/rftfit/workflow/measure.py). Logs are no inputs: their content is watched, by `state`.
from shlex import quote


rule stage:
    # What all rules share: the command of a job. It makes no job of its own.
    log:
        "results/logs/stage.log",
    conda:
        "../envs/rftfit.yaml"
    shell:
        f"python -P -m rftfit.workflow.job {{input.state:q}} --config {quote(CONFIG)} --threads {{threads}}"
        " --reads {input:q} --writes {output:q} 2> {log:q}"


use rule stage as clocks with:
    # Align the two logs of each push straight down.
    input:
        state=state_of("clocks"),
    output:
        "results/clocks/{medium}.parquet",
    log:
        "results/logs/clocks/{medium}.log",
    resources:
        mem_mb=memory_of,


use rule stage as ingest with:
    # Read force and motion logs: clocks of their sessions, frame, zero, phases.
    input:
        clocks=(
            expand("results/clocks/{medium}.parquet", medium=MEDIA)
            if ESTIMATED
            else []
        ),
        state=state_of("ingest"),
    output:
        traces="results/traces/{medium}.parquet",
        runs="results/runs/{medium}.csv",
        ledger="results/ledger/ingest/{medium}.csv",
        flags="results/flags/ingest/{medium}.csv",
    log:
        "results/logs/ingest/{medium}.log",
    resources:
        mem_mb=memory_of,


use rule stage as tare with:
    # Subtract rod-only runs at equal depth, legs turned in air at equal theta.
    input:
        traces="results/traces/{medium}.parquet",
        runs="results/runs/{medium}.csv",
        state=state_of("tare"),
    output:
        tared="results/tared/{medium}.parquet",
        tares="results/tares/{medium}.csv",
        ledger="results/ledger/tare/{medium}.csv",
        flags="results/flags/tare/{medium}.csv",
    log:
        "results/logs/tare/{medium}.log",
    resources:
        mem_mb=memory_of,


use rule stage as slopes with:
    # Fit zero-intercept slopes of stress against depth.
    input:
        runs="results/runs/{medium}.csv",
        tared="results/tared/{medium}.parquet",
        tares="results/tares/{medium}.csv",
        state=state_of("slopes"),
    output:
        fits="results/fits/{medium}.csv",
        windows="results/windows/{medium}.parquet",
        ledger="results/ledger/slopes/{medium}.csv",
        flags="results/flags/slopes/{medium}.csv",
    log:
        "results/logs/slopes/{medium}.log",
    resources:
        mem_mb=memory_of,


use rule stage as checks with:
    # Put the runs of each direction together, alpha(beta, gamma), and check whether it can be believed.
    input:
        runs="results/runs/{medium}.csv",
        tared="results/tared/{medium}.parquet",
        tares="results/tares/{medium}.csv",
        fits="results/fits/{medium}.csv",
        windows="results/windows/{medium}.parquet",
        flags=expand(
            "results/flags/{stage}/{{medium}}.csv", stage=["ingest", "tare", "slopes"]
        ),
        state=state_of("checks"),
    output:
        checks="results/checks/{medium}.csv",
        alpha="results/alpha/{medium}.csv",
        covariance="results/alpha_covariance/{medium}.csv",
        at_depth="results/alpha_at_depth/{medium}.csv",
        peers="results/peers/{medium}.csv",
        causes="results/causes/{medium}.csv",
        flags="results/flags/{medium}.csv",
    log:
        "results/logs/checks/{medium}.log",
    resources:
        mem_mb=memory_of,


use rule stage as legs with:
    # Average the force on turning legs over theta.
    input:
        runs="results/runs/{medium}.csv",
        tared="results/tared/{medium}.parquet",
        checks="results/checks/{medium}.csv",
        state=state_of("legs"),
    output:
        legs="results/legs/{medium}.csv",
        ledger="results/ledger/legs/{medium}.csv",
    log:
        "results/logs/legs/{medium}.log",
    resources:
        mem_mb=memory_of,


use rule stage as ledger with:
    # Account for every row of every log.
    input:
        runs=expand("results/runs/{medium}.csv", medium=MEDIA),
        books=expand(
            "results/ledger/{stage}/{medium}.csv",
            stage=["ingest", "tare", "slopes", "legs"],
            medium=MEDIA,
        ),
        robot="results/ledger/robot.csv" if ROBOT else [],
        state=state_of("ledger"),
    output:
        "results/ledger.csv",
    log:
        "results/logs/ledger.log",
