# From logs to alpha. Logs are no inputs for Snakemake: their content is watched, by `state`.


rule ingest:
    # Read force and motion logs: clocks, frame, zero, phases.
    input:
        PLAN.inputs("ingest"),
    output:
        update(PLAN.outputs("ingest")),
    log:
        "results/logs/ingest.log",
    # on all cores: first, while all are free
    priority: 2
    conda:
        "../envs/rftfit.yaml"
    threads: workflow.cores
    params:
        stage="ingest",
        state=PLAN.state("ingest"),
    shell:
        STAGE


rule tare:
    # Subtract rod-only runs at equal depth, legs turned in air at equal theta.
    input:
        PLAN.inputs("tare"),
    output:
        update(PLAN.outputs("tare")),
    log:
        "results/logs/tare.log",
    conda:
        "../envs/rftfit.yaml"
    params:
        stage="tare",
        state=PLAN.state("tare"),
    shell:
        STAGE


rule slopes:
    # Fit zero-intercept slopes of stress against depth.
    input:
        PLAN.inputs("slopes"),
    output:
        update(PLAN.outputs("slopes")),
    log:
        "results/logs/slopes.log",
    conda:
        "../envs/rftfit.yaml"
    params:
        stage="slopes",
        state=PLAN.state("slopes"),
    shell:
        STAGE


rule checks:
    # Put the runs of each direction together, alpha(beta, gamma), and check whether it can be believed.
    input:
        PLAN.inputs("checks"),
    output:
        update(PLAN.outputs("checks")),
    log:
        "results/logs/checks.log",
    conda:
        "../envs/rftfit.yaml"
    params:
        stage="checks",
        state=PLAN.state("checks"),
    shell:
        STAGE


rule legs:
    # Average the force on turning legs over theta.
    input:
        PLAN.inputs("legs"),
    output:
        update(PLAN.outputs("legs")),
    log:
        "results/logs/legs.log",
    # the figures wait for it
    priority: 1
    conda:
        "../envs/rftfit.yaml"
    params:
        stage="legs",
        state=PLAN.state("legs"),
    shell:
        STAGE


rule ledger:
    # Account for every row of every log.
    input:
        PLAN.inputs("ledger"),
    output:
        update(PLAN.outputs("ledger")),
    log:
        "results/logs/ledger.log",
    conda:
        "../envs/rftfit.yaml"
    params:
        stage="ledger",
        state=PLAN.state("ledger"),
    shell:
        STAGE
