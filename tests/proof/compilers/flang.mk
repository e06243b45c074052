# Compile sources with flang, each after those that it uses:
#
#   make -f tests/proof/compilers/flang.mk FLANG=flang-22 OUT=build/flang NAMES='pd_kinds ...'
layers := $(shell $(MAKE) -s --no-print-directory -f Makefile layers)
vpath %.f90 $(layers:%=src/%)

all: $(NAMES:%=$(OUT)/%.o)

$(OUT)/%.o: %.f90
	@$(FLANG) -c -O0 -fopenmp -module-dir $(OUT) -I$(OUT) $< -o $@

include $(OUT)/depends.mk
