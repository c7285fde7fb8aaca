# Logs to alpha tables: one job per medium and stage, never one per log.
# The digests among the params make a change of code, settings or run sheet rerun just what hangs on it.


rule ingest:
    input:
        logs=lambda wildcards: PLAN.logs(wildcards.medium),
    output:
        traces="results/traces/{medium}.parquet",
        runs="results/runs/{medium}.csv",
        ledger="results/ledger/ingest/{medium}.csv",
    log:
        "results/logs/ingest/{medium}.log",
    conda:
        "../envs/rftfit.yaml"
    params:
        campaign=CONFIG,
        code=PLAN.code("ingest"),
        # of other packages, whose code is part of the digest above
        dialects=PLAN.dialects(),
        # the content of the logs, whatever their dates say
        raw=lambda wildcards: PLAN.raw(wildcards.medium),
        rows=lambda wildcards: PLAN.rows(wildcards.medium),
        settings=PLAN.settings(
            "raw",
            "dialect",
            "force_log",
            "motion_log",
            "transducer",
            "arm",
            "clock",
            "surface",
            "rigid_contact",
            "intruders",
            "fit",
        ),
    shell:
        "python -m rftfit ingest config={params.campaign:q} medium={wildcards.medium:q}"
        " traces={output.traces:q} runs={output.runs:q} ledger={output.ledger:q} 2> {log:q}"


rule tare:
    input:
        traces="results/traces/{medium}.parquet",
        runs="results/runs/{medium}.csv",
    output:
        tared="results/tared/{medium}.parquet",
        tares="results/tares/{medium}.csv",
        ledger="results/ledger/tare/{medium}.csv",
    log:
        "results/logs/tare/{medium}.log",
    conda:
        "../envs/rftfit.yaml"
    params:
        campaign=CONFIG,
        code=PLAN.code("tare"),
        rows=lambda wildcards: PLAN.rows(wildcards.medium),
    shell:
        "python -m rftfit tare config={params.campaign:q} medium={wildcards.medium:q}"
        " traces={input.traces:q} runs={input.runs:q} tared={output.tared:q}"
        " tares={output.tares:q} ledger={output.ledger:q} 2> {log:q}"


rule slopes:
    input:
        runs="results/runs/{medium}.csv",
        tared="results/tared/{medium}.parquet",
        tares="results/tares/{medium}.csv",
    output:
        fits="results/fits/{medium}.csv",
        alpha=report(
            "results/alpha/{medium}.csv",
            caption="../report/alpha.rst",
            category=PROFILES,
            labels=shown("table", "alpha", "{medium}"),
        ),
        windows="results/windows/{medium}.parquet",
        ledger="results/ledger/slopes/{medium}.csv",
    log:
        "results/logs/slopes/{medium}.log",
    conda:
        "../envs/rftfit.yaml"
    params:
        campaign=CONFIG,
        code=PLAN.code("slopes"),
        rows=lambda wildcards: PLAN.rows(wildcards.medium),
        settings=PLAN.settings("transducer", "container", "intruders", "fit", "media"),
    shell:
        "python -m rftfit slopes config={params.campaign:q} medium={wildcards.medium:q}"
        " runs={input.runs:q} tared={input.tared:q} tares={input.tares:q} fits={output.fits:q}"
        " alpha={output.alpha:q} windows={output.windows:q} ledger={output.ledger:q} 2> {log:q}"


rule legs:
    input:
        runs="results/runs/{medium}.csv",
        tared="results/tared/{medium}.parquet",
    output:
        curves="results/legs/{medium}.csv",
        ledger="results/ledger/legs/{medium}.csv",
    log:
        "results/logs/legs/{medium}.log",
    conda:
        "../envs/rftfit.yaml"
    params:
        campaign=CONFIG,
        code=PLAN.code("legs"),
        rows=lambda wildcards: PLAN.rows(wildcards.medium),
    shell:
        "python -m rftfit legs config={params.campaign:q} medium={wildcards.medium:q}"
        " runs={input.runs:q} tared={input.tared:q} curves={output.curves:q}"
        " ledger={output.ledger:q} 2> {log:q}"


rule ledger:
    input:
        parts=expand(
            "results/ledger/{stage}/{medium}.csv",
            stage=["ingest", "tare", "slopes", "legs"],
            medium=PLAN.media,
        )
        + ["results/ledger/robot.csv"] * bool(PLAN.robot_medium),
        runs=expand("results/runs/{medium}.csv", medium=PLAN.media),
    output:
        ledger=report(
            "results/ledger.csv",
            caption="../report/ledger.rst",
            category=OVERVIEW,
            labels=shown("table", "what became of every row"),
        ),
    log:
        "results/logs/ledger.log",
    conda:
        "../envs/rftfit.yaml"
    params:
        campaign=CONFIG,
        code=PLAN.code("ledger"),
        # runs that belong to no medium are read here
        raw=lambda wildcards: PLAN.raw(""),
        rows=PLAN.rows(),
        settings=PLAN.settings("raw", "dialect", "force_log", "motion_log", "media"),
        parts=named("parts"),
        runs=named("runs"),
    shell:
        "python -m rftfit ledger config={params.campaign:q} {params.parts:q} {params.runs:q}"
        " ledger={output.ledger:q} 2> {log:q}"
