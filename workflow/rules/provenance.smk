# The record at the end: what every result was made from. `rftfit verify` reads it.


rule provenance:
    input:
        recorded_results,
    output:
        record="results/provenance.json",
        sums="results/manifest.sha256",
        sheet="results/run_sheet.csv",
        crate="results/ro-crate-metadata.json",
    log:
        "results/logs/provenance.log",
    conda:
        "../envs/rftfit.yaml"
    params:
        campaign=CONFIG,
        code=PLAN.code("provenance"),
        raw=lambda wildcards: PLAN.raw(),
        rows=PLAN.rows(),
        settings=PLAN.settings(),
        steps=lambda wildcards: PLAN.steps(workflow.rules, recorded_results(wildcards)),
    shell:
        "python -m rftfit provenance config={params.campaign:q} steps={params.steps:q}"
        " raw={params.raw} rows={params.rows} settings={params.settings} record={output.record:q}"
        " sums={output.sums:q} sheet={output.sheet:q} crate={output.crate:q} 2> {log:q}"
