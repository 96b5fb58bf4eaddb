"""What every room uses: whole files, encodings, progress, types of arrays. Nothing of winches."""
