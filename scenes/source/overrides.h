#pragma once
/// Changes to a scene before it is read: keys by their names, as "light.photons", from the command line; keyframes, and
/// numbers in file names, from frame to frame.

#include <string>
#include <vector>

#include "base/text/path_text.h"
#include "scenes/keys/json_reader.h"

namespace tensorray {

/// Applies "KEY=VALUE" (see read_scene) to a scene. Objects that KEY names and that do not exist are made. An index one
/// past the end of a list appends an item.
/// @throw SceneError: the text does not have that form, KEY leads through a value that is neither object nor list, or
/// an index is out of range.
void apply_override(Json& scene, const std::string& text);

/// Replaces each {field.scale} by the value of this key at the scene's frame: numbers with four digits, lists with
/// commas. Keys are named as by --set.
/// @throw SceneError if the scene does not give such a key, or a brace has no partner.
std::string with_values(const std::string& caption, const Json& scene, const SceneSource& source);

/// The frames of "7", "1-240", "1-240x2" (every second one), or of a list of these, "1,3,7-9": in this order, each
/// once; from 0 to 10^9.
/// @throw std::invalid_argument if the text does not have that form, or names more than a million frames, where one
/// that is named twice counts twice.
std::vector<int> parse_frames(const std::string& text);

/// Replaces, everywhere in a scene, keyframes by their value at a frame, and # in texts (also %04d and $F4, see
/// path_text.h) by the frame's number.
///
/// Keyframes take the place of a number or of a list of numbers:
/// {"keys": [[1, [0, 0, -1]], [240, [0, 1, -1]]], "ease": "smooth"}
/// Before the first key and behind the last one their values hold. "linear" (the default) goes straight to the next,
/// "smooth" by t²(3 − 2t).
/// @throw SceneError, with the place, if keyframes are not like this.
void set_frame(Json& scene, int frame, const SceneSource& source);

/// @throw SceneError, with the place, if the scene has keyframes.
void refuse_keyframes(const Json& scene, const SceneSource& source);

/// Lets keyframes take the place of every number, and of every list of numbers, of a schema. Their form is added to it
/// as `$defs/keyframes`.
void allow_keyframes(Json& schema);

}  // namespace tensorray
