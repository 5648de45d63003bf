#pragma once
#include <string>

#define TEMOTO_PRINT(message) stub_print(message, __func__)
#define TEMOTO_PRINT_OF(message, of) stub_print_of(message, __func__, of)

void stub_print(const std::string& message, const std::string& prefix);
void stub_print_of(const std::string& message, const std::string& prefix, const std::string& of);
