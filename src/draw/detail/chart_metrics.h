#pragma once

/// Sizes [px] that the layout and the SVG writer of charts must agree on.
namespace sentree::draw {

inline constexpr double kStateNameSize = 13;
inline constexpr double kStateNameHeight = 18;
inline constexpr double kStateLineSize = 11;
inline constexpr double kStateLineHeight = 15;
inline constexpr double kStatePaddingX = 12;
inline constexpr double kStatePaddingY = 7;
inline constexpr double kStateRule = 7;  ///< Room for the line between name and lines.
inline constexpr double kStateWidthMin = 64;
inline constexpr double kStateHeightMin = 34;
inline constexpr double kStateBoldFactor = 1.1;  ///< Bold text against the regular text that text_width() measures.
inline constexpr double kInitialSize = 14;       ///< Diameter of the dot.
inline constexpr double kHistorySize = 26;       ///< Diameter of the circle.
inline constexpr double kFinalInset = 3.5;       ///< Between the two outlines.
inline constexpr double kNestPadding = 16;       ///< Around the states within a state.
inline constexpr double kLabelSize = 11;
inline constexpr double kLabelHeight = 14.5;
inline constexpr double kChartMargin = 16;
inline constexpr double kChartTitleBlock = 30;  ///< The drawing's title with the space below it.
inline constexpr double kLoopWidth = 26;        ///< How far an arrow from a state to itself reaches out.

}  // namespace sentree::draw
