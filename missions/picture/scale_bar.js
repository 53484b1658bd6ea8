
const plot = document.getElementById("plan"), bar = $bar;
plot.on("plotly_relayout", () => {
  const [west, east] = plot._fullLayout.xaxis.range, [south, north] = plot._fullLayout.yaxis.range;
  const most = Math.abs(east - west) / 5, power = 10 ** Math.floor(Math.log10(most));
  const length = [5, 2, 1].map((step) => step * power).find((metres) => metres <= most);
  const x = west + (east - west) / 50, y = south + (north - south) / 50;
  if (plot.data[bar].x[0] === x && plot.data[bar].y[0] === y && plot.data[bar].x[1] === x + length) return;
  const text = " " + Number(length.toPrecision(1)) + " m";
  Plotly.restyle(plot, {x: [[x, x + length]], y: [[y, y]], text: [["", text]]}, [bar]);
});
