# Rules of what people look at (figures, workbooks, page), and the record of what it was made from.
from rftfit.workflow.stages import STAGES

# rules that write tables in a whole run of this campaign
TABLES = [
    getattr(rules, name)
    for name, declared in STAGES.items()
    if declared.room != "page" and not declared.on_demand and STATES.has_rule(name)
]


use rule stage as figure with:
    # Draw a figure.
    input:
        tables=of_figure("figures"),
        state=state_of("figure"),
    output:
        multiext("results/figures/{figure}", ".png", ".webp"),
    log:
        "results/logs/figure/{figure}.log",


use rule stage as quality with:
    # Draw the quality sheets: every plate run of a medium.
    input:
        tables=of_figure("quality"),
        state=state_of("quality"),
    output:
        multiext("results/quality/{medium}", ".png", ".webp"),
    log:
        "results/logs/quality/{medium}.log",
    # it takes longer than any other figure
    priority: 1


use rule stage as figure_pdf with:
    # Draw a figure for a paper.
    input:
        tables=of_figure("figures"),
        state=state_of("figure_pdf"),
    output:
        "results/figures/{figure}.pdf",
    log:
        "results/logs/figure_pdf/{figure}.log",


use rule stage as quality_pdf with:
    # Draw the quality sheets of a medium for a paper.
    input:
        tables=of_figure("quality"),
        state=state_of("quality_pdf"),
    output:
        "results/quality/{medium}.pdf",
    log:
        "results/logs/quality_pdf/{medium}.log",
    priority: 1


rule printed:
    # Every figure of a whole run for a paper: `rftfit run --print` makes them beside all else.
    input:
        STATES.paper_files,


use rule stage as workbooks with:
    # Write the workbooks in the layouts of Tables S5 and S2.
    input:
        checks=CHECKS,
        alpha=expand("results/alpha/{medium}.csv", medium=MEDIA),
        coefficients="results/coefficients.csv",
        penetration="results/penetration.csv",
        state=state_of("workbooks"),
    output:
        alpha="results/alpha_tables.xlsx",
        coefficients="results/coefficients.xlsx",
    log:
        "results/logs/workbooks.log",


use rule stage as page with:
    # Write the report page: all tables, and a preview of each figure.
    input:
        made_by(*TABLES, rules.figure, endings=[".csv", ".json", ".webp"]),
        [f"results/quality/{medium}.webp" for medium in names_in("quality")],
        # stress of the natural sands below the window of alpha
        expand("results/tared/{medium}.parquet", medium=SANDS),
        state=state_of("page"),
    output:
        page=report("results/report.html", category="Page"),
        findings="results/findings.csv",
    log:
        "results/logs/page.log",


use rule stage as provenance with:
    # Record what every result was made from.
    input:
        made_by(*TABLES, rules.figure, rules.workbooks, rules.page),
        expand(rules.quality.output, medium=names_in("quality")),
        state=state_of("provenance"),
    output:
        provenance="results/provenance.json",
        manifest="results/manifest.sha256",
        run_sheet="results/run_sheet.csv",
        package="results/datapackage.json",
    log:
        "results/logs/provenance.log",
