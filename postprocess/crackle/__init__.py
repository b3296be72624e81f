"""crackle's run files and comparison files: read, analysed, drawn. Lower layers never import higher ones:

    files       what stands in the files, checked, as arrays
    statistics  what follows from arrays: fits, intervals, avalanches, damage profiles; knows no file
    study       many runs together: ensembles, every fit made once, tables, the paper's values
    figures     what a figure shows, and how every figure looks
    page        the report

    from crackle.files import read_run
    run = read_run("crackle.h5")
    print(run.peak_load.mean())
"""
