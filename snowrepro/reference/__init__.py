"""What others measured of snow, to set the paper's laws beside."""
