"""The re-enacted lab: logs the way the real lab would have recorded them, from published results.

Shares no force code with the analysis. `enact.reenact` writes a campaign, `rig.FAULTS` lists what can
be broken in it on purpose; `rig.Lab` is what another lab derives from.
"""
