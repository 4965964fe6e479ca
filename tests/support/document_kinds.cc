// In test programs of the whole program, CheckFile knows the kinds of documents as mbverify does.
#include "program.h"

namespace mbv {
namespace {

[[maybe_unused]] const bool kKnown = (UseDocumentKinds(), true);

}  // namespace
}  // namespace mbv
