"""Spack recipe of perigeo: `spack dev-build perigeo` in the folder of the source."""
# ruff: noqa: F403, F405

from spack.package import *


class Perigeo(MakefilePackage):
    """Peridynamics for geomaterials: plane strain, plasticity with softening, shear bands."""

    license("MIT")

    version("0.1.0")

    variant("mpi", default=False, description="Also build perigeo-mpi, for several ranks")
    variant("post", default=True, description="Python package perigeo_post, reader and figures")

    depends_on("c", type="build")
    depends_on("fortran", type="build")
    depends_on("gmake", type="build")
    depends_on("hdf5+fortran+hl")
    depends_on("mpi", when="+mpi")
    depends_on("python@3.9:", type=("build", "run"))
    with when("+post"):
        depends_on("py-numpy@1.22:", type=("build", "run"))
        depends_on("py-h5py@3.6:", type=("build", "run"))
        depends_on("py-matplotlib@3.6:", type=("build", "run"))
        depends_on("py-pillow@9.1:", type=("build", "run"))
        depends_on("py-pydantic@2.7:", type=("build", "run"))
        depends_on("py-simpleeval", type=("build", "run"))
        depends_on("py-jinja2@3:", type=("build", "run"))

    def settings(self, spec):
        """What make is told: the compilers, and no flag for the processor, which Spack adds."""
        return [f"FC={spack_fc}", f"H5FC={spec['hdf5'].prefix.bin.h5fc}", "MARCH="]

    def build(self, spec, prefix):
        make("program", *self.settings(spec))
        if spec.satisfies("+mpi"):
            make("program", "MPI=1", *self.settings(spec))

    def install(self, spec, prefix):
        post = [f"PYTHON={spec['python'].command.path}"] if spec.satisfies("+post") else ["POST=0"]
        make("install", f"PREFIX={prefix}", *post, *self.settings(spec))
        if spec.satisfies("+mpi"):
            install("bin/perigeo-mpi", prefix.bin)
