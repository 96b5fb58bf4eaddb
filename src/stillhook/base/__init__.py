"""What every package uses: complete files, encodings, progress, types of arrays. Nothing of winches."""
