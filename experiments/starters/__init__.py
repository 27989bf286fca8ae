"""What `idbench new` writes: a scenario, a study, a package of a plug-in to start from."""
