# Run a case and draw its figures:  sh tools/demo.sh INPUT.nml FOLDER
#
# FOLDER is where the input file sends its results; its last part is the name of the run.
input=$1
folder=$2
name=${folder##*/}
post=.venv/bin/perigeo-post
result=$folder/$name.h5

bin/perigeo --force "$input" || exit

echo "Drawing the figures"
$post curves "$result" -o "$folder/curves.png" || exit
$post contours "$result" --field plastic_strain -o "$folder/contours.png" || exit
$post band "$result" -o "$folder/band.png" || exit

echo
echo "Results of $input:"
echo "  $folder/curves.png     stress against strain"
echo "  $folder/contours.png   plastic strain: the shear bands"
echo "  $folder/band.png       profile across the band"
echo "  $folder/$name.xdmf  for ParaView"
echo "  $folder/${name}_history.csv, $folder/$name.log"
