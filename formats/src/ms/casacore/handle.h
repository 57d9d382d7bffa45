// What the sources of the shim share.
#pragma once
#include "shim.h"

#include <casacore/casa/Exceptions/Error.h>
#include <casacore/tables/Tables/Table.h>

#include <exception>
#include <string>

struct CtTable {
    casacore::Table table;
};

// Texts that outlive the call that made them.
namespace ct {
std::string& last_error();
std::string& last_text();
}  // namespace ct

// Run f; an exception becomes a code and a message.
template <typename F>
int guard(F f) {
    try {
        f();
        return 0;
    } catch (const std::exception& e) {
        ct::last_error() = e.what();
    } catch (...) {
        ct::last_error() = "an unknown exception";
    }
    return 1;
}
