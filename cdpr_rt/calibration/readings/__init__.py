"""What a calibration measured: files of readings, and the arrays that the fit takes."""
