"""The data set of a validation: campaign, records and their coverage (step 0)."""
