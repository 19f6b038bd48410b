"""One recording written as every kind of file, by other means than the readers."""

from __future__ import annotations

import numpy as np
from hdfast.recordings import Recording, save

KINDS = ("run.csv", "run.parquet", "run.npz", "v5.mat", "v73.mat", "run.h5", "run.mf4", "run.tdms")


def write(path, columns):
    """Write columns (n,) by name; the kind follows the name of the file."""
    if path.name in ("run.csv", "run.parquet", "run.npz"):
        save(Recording("run", columns), path)
    elif path.name == "v5.mat":
        from scipy.io import savemat

        savemat(path, {name: values[:, None] for name, values in columns.items()})
    elif path.name == "v73.mat":
        import h5py

        with h5py.File(path, "w", userblock_size=512) as file:
            for name, values in columns.items():
                file[name] = values[None, :]
                file[name].attrs["MATLAB_class"] = np.bytes_("double")
        with path.open("r+b") as stream:
            stream.write(b"MATLAB 7.3 MAT-file".ljust(124) + b"\x00\x02IM")
    elif path.name == "run.h5":
        import h5py

        with h5py.File(path, "w") as file:
            for name, values in columns.items():
                file.create_dataset(name, data=values, chunks=True, compression="gzip")
    elif path.name == "run.mf4":
        from asammdf import MDF, Signal

        with MDF() as file:
            signals = [Signal(v, columns["t"], name=name) for name, v in columns.items() if name != "t"]
            file.append(signals)
            file.save(path, overwrite=True)
    else:
        from nptdms import ChannelObject, TdmsWriter

        with TdmsWriter(path) as writer:
            writer.write_segment([ChannelObject("run", name, values) for name, values in columns.items()])
    return path
