// The dozen and a half functions of casacore's table system that a Measurement Set needs, with C linkage.
// Every function that returns int returns 0 when it worked; otherwise ct_error() says what casacore said.
// No exception ever leaves a function. The caller serialises all calls: casacore's table cache is shared.
#pragma once
#include <cstddef>
#include <cstdint>

extern "C" {

struct CtTable;

// Element types, as numbered on the Rust side.
enum CtType { CT_BOOL = 0, CT_INT = 1, CT_FLOAT = 2, CT_DOUBLE = 3, CT_COMPLEX = 4, CT_STRING = 5 };

// Storage managers, as numbered on the Rust side.
enum CtManager { CT_STANDARD = 0, CT_INCREMENTAL = 1, CT_TILED_SHAPE = 2, CT_TILED_COLUMN = 3 };

// A column: ndim < 0 is a scalar, 0 an array of any dimension; a fixed shape has n_shape > 0. Shapes: fastest axis first.
struct CtColumn {
    const char* name;
    const char* comment;
    int32_t type;
    int32_t ndim;
    const int64_t* shape;
    int32_t n_shape;
};

const char* ct_error();

// casacore writes in destructors. An exception there (a full disk) cannot be caught: it ends the process. From now on `end` is called with the
// text of such an exception first. It must not return.
void ct_on_terminate(void (*end)(const char* what));

int ct_create(const char* path, CtTable** out);
// With `change` the table can be written.
int ct_open(const char* path, int32_t change, CtTable** out);
// Open and read the table in a child process; an error where that process dies.
int ct_probe(const char* path);
// Bytes that can still be written to the file system of a path.
int ct_free_bytes(const char* path, uint64_t* bytes);
int ct_flush(CtTable* table);
// Close; with `discard` the files of the table are removed and nothing is flushed.
void ct_close(CtTable* table, int32_t discard);

int ct_set_info(CtTable* table, const char* type, const char* readme);
int ct_add_columns(CtTable* table, const CtColumn* columns, size_t n, int32_t manager, const char* manager_name, const int64_t* tile,
                   size_t n_tile);
int ct_add_rows(CtTable* table, uint64_t n);
uint64_t ct_n_rows(const CtTable* table);

// Type and dimensions of a column; *type = -1 where there is no such column or its type is not one of CtType.
int ct_column_info(const CtTable* table, const char* column, int32_t* type, int32_t* ndim);
// Shape of a cell; *n = -1 where the cell holds no array, 0 for a scalar. `shape` has room for 8.
int ct_cell_shape(const CtTable* table, const char* column, uint64_t row, int64_t* shape, int32_t* n);

// A run of rows whose cells all have the given shape (n_shape = 0: scalars). `data` holds them one after another.
int ct_put(CtTable* table, const char* column, int32_t type, uint64_t start, uint64_t rows, const int64_t* shape, size_t n_shape,
           const void* data);
int ct_get(const CtTable* table, const char* column, int32_t type, uint64_t start, uint64_t rows, const int64_t* shape, size_t n_shape,
           void* data);

// Strings, one cell at a time; n < 0 puts a scalar. A string got is valid until the next call.
int ct_put_strings(CtTable* table, const char* column, uint64_t row, int32_t n, const char* const* values);
int ct_get_string(const CtTable* table, const char* column, uint64_t row, size_t index, const char** value);

// Keywords of the table (column = NULL) or of a column, at the top (group = NULL) or in a record. n < 0 puts a scalar.
int ct_put_keyword(CtTable* table, const char* column, const char* group, const char* key, int32_t type, int32_t n, const void* values);
int ct_put_table_keyword(CtTable* table, const char* key, const CtTable* subtable);
// Names of the columns, or (keywords = 1) of the keywords of the table (group = NULL) or of a record, in lines: a letter for the type, a blank,
// the name. Letters: b truth value, i integer, f real number, s text, t table, r record, o anything else, c column.
int ct_names(const CtTable* table, const char* group, int32_t keywords, const char** text);
// *found = 0 where the keyword is missing, has another type, or no element of that index.
int ct_get_keyword(const CtTable* table, const char* column, const char* group, const char* key, size_t index, int32_t* found,
                   double* number, const char** text);
}
