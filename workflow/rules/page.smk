# The report page: all tables of a run in one self-contained file.


rule page:
    input:
        alpha=alpha_tables(PLAN.media),
        runs=expand("results/runs/{medium}.csv", medium=PLAN.media),
        fits=expand("results/fits/{medium}.csv", medium=PLAN.media),
        legs=expand("results/legs/{medium}.csv", medium=PLAN.media),
        coefficients="results/coefficients.csv",
        penetration="results/penetration.csv",
        reproduction="results/reproduction.csv",
        ledger="results/ledger.csv",
        predicted="results/predicted.csv",
        errors="results/leg_errors.csv",
        sands="results/sands.csv",
        correction="results/sand_correction.csv",
        robot=expand(
            "results/robot/{name}",
            name=["speed.csv", "errors.csv", "optimum.csv", "frames.json"],
        )
        * bool(PLAN.robot_medium),
    output:
        report="results/report.html",
    log:
        "results/logs/page.log",
    conda:
        "../envs/rftfit.yaml"
    params:
        campaign=CONFIG,
        # all stages: the page says which program made the tables
        code=PLAN.code(),
        rows=PLAN.rows(),
        settings=PLAN.settings(),
        alpha=named("alpha"),
        runs=named("runs"),
        fits=named("fits"),
        legs=named("legs"),
        robot=named("robot"),
    shell:
        "python -m rftfit page config={params.campaign:q} {params.alpha:q} {params.runs:q}"
        " {params.fits:q} {params.legs:q} coefficients={input.coefficients:q}"
        " penetration={input.penetration:q} reproduction={input.reproduction:q}"
        " ledger={input.ledger:q} predicted={input.predicted:q} leg_errors={input.errors:q}"
        " sands={input.sands:q} sand_correction={input.correction:q} code={params.code} settings={params.settings}"
        " rows={params.rows} {params.robot:q} report={output.report:q}"
        " 2> {log:q}"
