#pragma once

#include <duktape.h>

// Of the files that errors come from, the name alone: the same sources give the same program in whatever folder.
#undef DUK_FILE_MACRO
#define DUK_FILE_MACRO __FILE_NAME__
