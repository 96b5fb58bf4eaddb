"""Tables of numbers in text, Excel and Parquet: opened, split into cells, and read as columns with units."""
