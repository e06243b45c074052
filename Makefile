# perigeo: `make help` lists the targets. Needs GNU make 3.81 or later and a POSIX shell.
#
# The layers are the folders of src/: a module may use modules of its own folder and of folders
# before it in this list. `make lint` checks it.
layers := base system input body operators material loads motion setup output app

# ---------------------------------------------------------------------------------- settings
BUILD  = opt
MARCH  = native
PREFIX = /usr/local
ALIGNED = 1

ifneq ($(filter default undefined,$(origin FC)),)
  FC = gfortran
endif

ifeq ($(BUILD),opt)
  FFLAGS = -O3
  march  = $(addprefix -march=,$(MARCH))
  program = bin/perigeo
  unit_flags = -O1 -g -fbacktrace
else ifeq ($(BUILD),debug)
  FFLAGS = -Og -g -fcheck=all,no-array-temps -ffpe-trap=invalid,zero,overflow -finit-real=snan \
    -fbacktrace
  march  =
  program = bin/perigeo-debug
  unit_flags = $(FFLAGS)
else ifeq ($(BUILD),lint)
  FFLAGS = -Werror
  march  =
  program = build/lint/perigeo
  unit_flags = $(FFLAGS) $(warnings) -Wno-compare-reals $(no_false_warnings)
else ifeq ($(BUILD),mutants)
  # The checks of the checking build, quicker, and all modules in a library: one is compiled anew
  # without linking program and suites. Variables that are not set have numbers that do harm.
  FFLAGS = -O1 -fPIC -fcheck=bounds -ffpe-trap=invalid,zero,overflow -finit-real=snan \
    -finit-integer=-77777 -finit-logical=false
  march  =
  ALIGNED = 0
  program = build/mutants/perigeo$(if $(MPI),-mpi)
  unit_flags = -O0 -ffpe-trap=invalid,zero,overflow
  library = build/mutants/libperigeo$(if $(MPI),-mpi).so
else
  $(error BUILD=$(BUILD): it must be opt or debug)
endif

# MPI=1 builds the program for several ranks, beside the other one: mpi/pd_ranks.f90 takes the
# place of src/base/pd_ranks.f90.
ifneq ($(MPI),)
  program := $(patsubst bin/perigeo%,bin/perigeo-mpi%,$(program))
endif

warnings := -Wall -Wextra -Wpedantic -Wimplicit-interface -Wconversion
# gfortran warns of allocatable variables that are not allocated yet, without reason.
no_false_warnings := -Wno-uninitialized -Wno-maybe-uninitialized
ifeq ($(BUILD),lint)
  warnings += -Wno-maybe-uninitialized
else
  warnings += $(no_false_warnings)
endif
flags     = -std=f2008 $(strip $(FFLAGS) $(march)) -fopenmp
venv     := .venv
build    := build/$(BUILD)$(if $(MPI),-mpi)

# ---------------------------------------------------------------------------------- targets
.SUFFIXES:
.DELETE_ON_ERROR:
studies := fig3a fig3b fig4 fig5 seeds horizon loading size softening influence heterogeneity \
  zero_energy equilibrium
# Targets that need no compiler, or see to it themselves.
sets_up := all setup first-footing uninstall wheel demo demo-quick test debug lint verify layers \
  help clean distclean figures $(studies) report report-view gallery tutorials site site-view \
  bench clouds finite_elements limit_loads mutants fuzz soak sanitize compilers pythons test_ranks \
  scaling
.PHONY: program objects post units install $(sets_up)
.DEFAULT_GOAL := all

help_width := 13

# Recursive calls compile on all cores unless the user has given -j.
cores    := $(shell getconf _NPROCESSORS_ONLN 2>/dev/null || echo 2)
parallel  = $(if $(filter -j% --jobserver%,$(MAKEFLAGS)),,-j$(cores))
submake   = $(MAKE) --no-print-directory

all:               ## build bin/perigeo and install perigeo-post into .venv (the default)
	+@$(submake) $(parallel) program post

setup:             ## install what is missing: compiler, HDF5, Python packages in .venv
	@sh tools/setup.sh run

demo:              ## from a fresh machine to the figures of the reference case in results/
	@sh tools/setup.sh run
	@$(submake) $(parallel) program
	@sh tools/demo.sh input/compression.nml results/compression

demo-quick:        ## the same with a coarse body: seconds instead of minutes
	@sh tools/setup.sh run
	@$(submake) $(parallel) program
	@sh tools/demo.sh input/compression_quick.nml results/compression_quick

figures:           ## all studies below: every figure of the paper and the comparison with it
fig3a:             ## study: apparent modulus against m at a fixed horizon
fig3b:             ## study: apparent modulus against m at a fixed spacing
fig4:              ## study: shear bands and their width against m
fig5:              ## study: shear bands of the reference case at 1, 1.3 and 1.6 % strain
seeds:             ## study: when one of two bands takes over: seeds, rate, damping
horizon:           ## study: width of the band against the horizon
loading:           ## study: platens, rate of loading, confining pressure
size:              ## study: size and shape of the specimen
softening:         ## study: kinds of softening, its modulus, the residual strength
influence:         ## study: influence functions
heterogeneity:     ## study: soil whose strength varies from place to place
zero_energy:       ## study: controls of zero-energy modes: noise, bands, limit load
equilibrium:       ## studies: motion or equilibrium after the peak, limit load of a footing
equilibrium: asked = equilibrium footing
figures: asked = $(studies) footing
figures $(studies):
	@sh tools/setup.sh run
	@$(submake) $(parallel) program
	@sh tools/studies.sh $(or $(asked),$@)

report:            ## results/report.html, one page with all studies, after making what is missing
	@$(submake) figures || failed=$$?; \
	  $(venv)/bin/perigeo-post report $(if $(PUBLISH),--publish) && exit $${failed:-0}

report-view:       ## open that page in a browser without a window: checks and screenshots
	@sh tools/python_env.sh view
	@$(venv)/bin/python tools/view_report.py

test:              ## set-up, build and the whole test suite; BUILD=debug: with all checks
	@sh tools/setup.sh test
	@$(if $(MPI),sh tools/setup.sh mpi && $(submake) MPI= $(parallel) program && \
	  $(submake) $(parallel) program)
	@$(venv)/bin/python tests/support/run_tests.py --make '$(MAKE) MPI=' --build $(BUILD)

test_ranks:        ## the tests with several ranks alone, after installing Open MPI if need be
	@sh tools/setup.sh test
	@sh tools/setup.sh mpi
	@$(submake) $(parallel) program && $(submake) MPI=1 $(parallel) program
	@$(venv)/bin/python -m pytest -q tests/cases/test_ranks.py

debug:             ## build bin/perigeo-debug, which checks bounds and traps invalid numbers
	@$(submake) BUILD=debug program

layers:
	@echo $(layers)

lint:              ## compiler warnings as errors, Fortran and Python linters, layer check
	@sh tools/setup.sh lint
	@sh tools/lint.sh '$(MAKE)' $(parallel)

gallery:           ## draw every kind of figure, in results/gallery; PUBLISH=1: into doc/gallery.md
	@sh tools/setup.sh run
	@$(submake) $(parallel) program
	@$(venv)/bin/python tools/make_gallery.py $(if $(PUBLISH),--publish)

first-footing:     ## type doc/first_footing.md in a fresh clone and time it; PUBLISH=1: its table
	@sh tools/setup.sh run
	@$(venv)/bin/python tools/first_footing.py $(if $(PUBLISH),--publish)

tutorials:         ## type every tutorial from its page in full and check its numbers: minutes
	@sh tools/setup.sh test
	@$(submake) $(parallel) program
	@TUTORIALS=full $(venv)/bin/python -m pytest -q tests/cases/test_tutorials.py

site:              ## documents, tutorials, gallery and modules as pages: build/site/index.html
	@sh tools/setup.sh site
	@$(venv)/bin/python tools/make_site.py build/site

site-view: site    ## open these pages in a browser without a window: checks and screenshots
	@sh tools/python_env.sh view
	@$(venv)/bin/python tools/view_site.py

verify:            ## compare computed values with closed forms, printed as a table
	@sh tools/setup.sh test
	@$(submake) $(parallel) program
	@$(venv)/bin/python tests/verify/verify.py $(if $(PUBLISH),--publish)

limit_loads:       ## limit loads against exact solutions, on several grids; PUBLISH=1: into doc/
	@sh tools/setup.sh test
	@$(submake) $(parallel) program
	@$(venv)/bin/python tests/verify/limits.py $(if $(PUBLISH),--publish)

clouds:            ## points off a lattice: stress, compression, cost; PUBLISH=1: doc/model.md
	@sh tools/setup.sh test
	@$(submake) $(parallel) program
	@$(venv)/bin/python tests/verify/clouds.py $(if $(PUBLISH),--publish)

finite_elements:   ## perigeo beside finite elements (CalculiX, kept curves); PUBLISH=1: into doc/
	@sh tools/setup.sh test
	@$(submake) $(parallel) program
	@$(venv)/bin/python tests/verify/finite_elements.py $(if $(PUBLISH),--publish)

fuzz:              ## 10,000 mutated inputs, clouds and studies; COUNT=, SEED=, WORKERS=
	@sh tools/setup.sh test
	@$(submake) BUILD=debug $(parallel) program
	@$(venv)/bin/python tests/proof/fuzz/fuzz.py --count $(or $(COUNT),10000) \
	  --seed $(or $(SEED),1) --workers $(or $(WORKERS),$(cores))

soak:              ## random kills, damaged checkpoints, full disks; MINUTES=20 or KILLS=, SEED=
	@sh tools/setup.sh test
	@$(submake) $(parallel) program
	@$(venv)/bin/python tests/proof/soak/soak.py --minutes $(or $(MINUTES),20) \
	  $(if $(KILLS),--kills $(KILLS)) --seed $(or $(SEED),1)

sanitize:          ## races, addresses, undefined behaviour, valgrind; PARTS='races address'
	@sh tools/setup.sh test
	@$(submake) BUILD=debug $(parallel) program
	@MAKE_COMMAND='$(MAKE)' $(venv)/bin/python tests/proof/sanitize/sanitize.py $(PARTS)

compilers:         ## build and test with every gfortran-N, compile with flang, as installed
	@sh tools/setup.sh test
	@MAKE_COMMAND='$(MAKE)' $(venv)/bin/python tests/proof/compilers/compilers.py $(COMPILERS)

pythons:           ## perigeo-post with the oldest and newest Python packages that are allowed
	@sh tools/setup.sh run
	@$(submake) $(parallel) program
	@$(venv)/bin/python tests/proof/pythons/pythons.py $(PYTHONS)

bench:             ## measure the speed on this machine; PUBLISH=1: into doc/performance.md
	@sh tools/setup.sh test
	@$(submake) $(parallel) program build/opt/bench/machine
	@$(submake) $(parallel) ALIGNED=0 build=build/unaligned program=build/unaligned/perigeo program
	@$(venv)/bin/python tests/bench/bench.py $(if $(PUBLISH),--publish)

scaling:           ## predicted efficiency of many ranks; PUBLISH=1: into doc/parallel.md
	@sh tools/setup.sh test
	@sh tools/setup.sh mpi
	@$(submake) MPI=1 $(parallel) program
	@$(venv)/bin/python tests/bench/scaling.py $(if $(PUBLISH),--publish) $(if $(MEASURE),--measure)

mutants:           ## plant faults in the physics, one at a time: do the tests notice? COUNT= SEED=
	@sh tools/setup.sh test
	@sh tools/setup.sh mpi
	@$(submake) $(parallel) BUILD=mutants PFUNIT_DIR= program units
	@$(submake) $(parallel) BUILD=mutants MPI=1 program
	@$(venv)/bin/python tests/proof/mutants/mutants.py $(if $(COUNT),--count $(COUNT)) \
	  $(if $(SEED),--seed $(SEED)) $(if $(ONLY),--only $(ONLY))

to_prefix = PREFIX='$(PREFIX)' DESTDIR='$(DESTDIR)' PYTHON='$(PYTHON)' POST='$(POST)' \
  sh tools/install.sh

install: program   ## program, perigeo-post, inputs, man pages, completion: PREFIX=/usr/local
	@$(to_prefix) install $(program)

uninstall:         ## take away what make install has put into PREFIX
	@$(to_prefix) uninstall

wheel:             ## perigeo-post as a wheel, in build/wheel
	@sh tools/python_env.sh run
	@rm -rf build/wheel && mkdir -p build/wheel && cp -R postproc build/wheel/source
	@$(venv)/bin/python -m pip wheel --quiet --disable-pip-version-check --no-deps \
	  --wheel-dir build/wheel build/wheel/source && rm -rf build/wheel/source
	@ls build/wheel/*.whl

clean:             ## remove what was built; keeps .venv and results
	rm -rf build bin

distclean: clean   ## remove .venv and results too
	rm -rf $(venv) results

help:              ## list the targets
	@echo 'Targets:'
	@awk -F ':.*## ' '/^[a-z0-9_-]+:.*## / { printf "  make %-15s %s\n", $$1, $$2 }' Makefile
	@echo 'Settings:'
	@echo '  MARCH=x86-64-v3   processor to compile for (native; empty: any)'
	@echo '  FFLAGS=-O2        optimisation flags (-O3)'
	@echo '  BUILD=debug       with make test: use the program with all checks'
	@echo '  FC=, H5FC=        Fortran compiler (gfortran) and HDF5 wrapper (h5fc)'
	@echo '  ALIGNED=0         arrays begin where malloc puts them, not at a line of the cache'
	@echo '  PFUNIT_DIR=DIR    with make test: use the pFUnit installed in DIR'
	@echo '  NO_INSTALL=1      never install anything'
	@echo '  PREFIX=, DESTDIR= with make install: where to (/usr/local), and what stands before it'
	@echo '  PYTHON=, POST=0   with make install: the Python of perigeo-post; without perigeo-post'
	@echo '  V=1               show the commands'

# ---------------------------------------------------------------------------------- compiling
# The rest needs the compiler and HDF5, which `make demo` may have to install first.
ifneq ($(filter-out $(sets_up),$(or $(MAKECMDGOALS),all)),)

ifeq ($(shell command -v $(firstword $(FC)) 2>/dev/null),)
  $(error no Fortran compiler ($(FC)): `make setup` installs or names what is missing)
endif
# Not every gfortran knows the processor it runs on.
ifeq ($(MARCH),native)
  ifeq ($(shell echo end | $(FC) -march=native -fsyntax-only -x f95 - 2>/dev/null && echo yes),)
    march =
  endif
endif
ifneq ($(MPI),)
  mpi_compile := $(shell sh tools/mpi_flags.sh compile)
  mpi_link    := $(shell sh tools/mpi_flags.sh link)
  ifeq ($(mpi_link),)
    $(error no MPI for Fortran (mpifort): run tools/setup.sh mpi, which installs or names it)
  endif
endif
hdf5_compile := $(shell H5FC='$(H5FC)' sh tools/hdf5_flags.sh compile '$(FC)')
hdf5_link    := $(shell H5FC='$(H5FC)' sh tools/hdf5_flags.sh link '$(FC)')
ifeq ($(hdf5_link),)
  $(error no HDF5 library for Fortran: `make setup` installs or names what is missing)
endif

# Arrays at the start of a cache line (src/system/pd_memory.f90), where linker and C library can
# do it. What it gains is in doc/performance.md; ALIGNED=0 goes without.
# Folders come first: what make has looked for and not found, it does not look for again.
update := $(shell mkdir -p $(build)/try $(build)/unit bin)
wrapped := -Wl,--wrap=malloc,--wrap=realloc,--wrap=calloc
ifneq ($(ALIGNED),0)
  aligned := $(shell echo end | $(FC) -J$(build)/try src/system/pd_memory.f90 -x f95 - \
    $(wrapped) -o $(build)/try/link 2>/dev/null && echo $(wrapped))
endif
left_out := $(if $(aligned),,pd_memory)

sources := $(filter-out $(left_out:%=src/system/%.f90),$(wildcard $(layers:%=src/%/*.f90)))
sources := $(if $(MPI),$(sources:src/base/pd_ranks.f90=mpi/pd_ranks.f90),$(sources))
objects := $(patsubst %.f90,$(build)/%.o,$(notdir $(sources))) $(build)/pd_version.o
vpath %.f90 $(if $(MPI),mpi) $(layers:%=src/%) $(build)
compile  = $(FC) $(flags) $(warnings) $(hdf5_compile) $(mpi_compile) -J$(build)
say      = $(if $(V),,@echo '  $(1)';)

# These files change only when their contents do: what everything depends on, and the version.
update := $(shell echo '$(compile) $(hdf5_link) $(mpi_link) $(aligned)' | \
  sh tools/update_file.sh $(build)/flags; \
  sh tools/version.sh '$(FC)' '$(flags)' | sh tools/update_file.sh $(build)/pd_version.f90)

program: $(if $(wildcard src/app/perigeo.f90),$(program),objects)
objects: $(objects)

$(program): $(objects) $(library)
	$(call say,link     $@)$(FC) $(flags) -o $@ $(if $(library),$(build)/perigeo.o $(library),\
	  $(objects)) $(hdf5_link) $(mpi_link) $(aligned)

ifneq ($(library),)
$(library): $(filter-out %/perigeo.o,$(objects))
	$(call say,link     $@)$(FC) $(flags) -shared -Wl,-soname,$(notdir $@) -o $@ $^ $(hdf5_link) \
	  $(mpi_link)
endif

$(build)/%.o: %.f90 $(build)/flags
	$(call say,compile  $<)$(compile) -c $< -o $@

# What this machine can do: memory bandwidth and arithmetic, for `make bench`.
$(build)/bench/machine: tests/bench/machine.f90 $(build)/pd_kinds.o
	@mkdir -p $(dir $@)
	$(call say,link     $@)$(FC) $(flags) -I$(build) -J$(dir $@) -o $@ $^

# Python is optional here: without it the program is built all the same.
post:
	@sh tools/python_env.sh run || \
	  echo 'perigeo-post is not installed; the program does not need it.'

# ---------------------------------------------------------------------------------- unit tests
# One program for each suite tests/unit/LAYER/test_*.pf, with pFUnit or with the small runner in
# tests/support. Modules that suites share are tests/unit/*.f90.
python  := $(firstword $(wildcard $(venv)/bin/python) python3)
suites  := $(filter-out $(left_out:%=test_%), \
  $(patsubst %.pf,%,$(notdir $(wildcard $(layers:%=tests/unit/%/test_*.pf)))))
vpath %.pf $(layers:%=tests/unit/%)
support := tests/support

ifneq ($(PFUNIT_DIR),)
  pfunit_mk := $(firstword $(wildcard $(PFUNIT_DIR)/PFUNIT-*/include/PFUNIT.mk \
    $(PFUNIT_DIR)/include/PFUNIT.mk))
  ifeq ($(pfunit_mk),)
    $(error PFUNIT_DIR=$(PFUNIT_DIR): no PFUNIT.mk there; name the folder pFUnit was installed to)
  endif
  include $(pfunit_mk)
  unit      := $(build)/unit-pfunit
  runner    :=
  translate  = $(python) $(PFUNIT_BIN_DIR)/funitproc -quiet $(1) $(2)
  unit_form := F90
  unit_std  := -cpp
  unit_with  = $(PFUNIT_EXTRA_FFLAGS)
  unit_libs  = $(PFUNIT_LIBRARIES)
  driver     = -D_TEST_SUITES='"$(1).inc"' -I$(unit)/$(1).modules $(PFUNIT_INCLUDE_DIR)/driver.F90
else
  unit      := $(build)/unit
  runner    := $(unit)/funit.o
  translate  = $(python) $(support)/pf_to_f90.py $(1) $(2)
  unit_form := f90
  unit_std  := -std=f2008
endif

unit_compile = $(FC) $(unit_std) $(strip $(unit_flags)) -fopenmp -ffree-line-length-none \
  -I$(build) $(hdf5_compile) $(unit_with)

units: $(suites:%=$(unit)/%)

suites:
	@echo $(suites)

$(unit)/funit.o: $(support)/funit.f90 $(unit)/flags
	$(call say,compile  $<)$(unit_compile) -J$(unit) -c $< -o $@

$(unit)/%.o: tests/unit/%.f90 $(unit)/flags
	$(call say,compile  $<)$(unit_compile) -J$(unit) -c $< -o $@

$(unit)/%.$(unit_form): %.pf $(support)/pf_to_f90.py
	@$(call translate,$<,$@)

# Modules of a suite go to a folder of its own: with pFUnit every driver has the same names. What
# a suite is linked with is in depends.mk.
$(suites:%=$(unit)/%): $(unit)/%: $(unit)/%.$(unit_form) $(runner) | $(library)
	@mkdir -p $@.modules
	@echo 'ADD_TEST_SUITE($*_suite)' > $@.modules/$*.inc
	$(call say,compile  $*.pf)$(unit_compile) -I$(unit) -J$@.modules -o $@ $< \
	  $(call driver,$*) $(filter $(if $(library),$(unit)/)%.o,$^) $(library) $(unit_libs) \
	  $(hdf5_link)

# Who uses whom, written anew when it has changed.
update := $(shell mkdir -p $(unit); \
  echo '$(unit_compile) $(hdf5_link)' | sh tools/update_file.sh $(unit)/flags; \
  awk -f tools/depends.awk -v build=$(build) -v unit=$(unit) $(sources) \
    $(wildcard tests/unit/*.f90 $(layers:%=tests/unit/%/test_*.pf)) | \
    sh tools/update_file.sh $(unit)/depends.mk)
include $(unit)/depends.mk

endif
