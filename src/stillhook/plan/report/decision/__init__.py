"""The decision page of a lift plan and its limits card: as plain data, and as parts of a document. Both follow from the
data and the facts of a result alone; what is missing there is "not assessed", and no plan is for approval without."""
